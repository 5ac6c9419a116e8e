// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Messages.h - What clients and fork servers say to each other -------===//
//
// A client asks by one message, whose bytes are the tool's name, and which has
// open files: a Request's bytes, the working folder, and the client's own. The
// answers are integers: the number of the process, then how it ended.

#ifndef PIKO_TEST_FORKSERVER_MESSAGES_H
#define PIKO_TEST_FORKSERVER_MESSAGES_H

#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/uio.h>

namespace piko::forks {

/// Where a client finds the launcher, and the folder of it.
inline constexpr const char folderVariable[] = "PIKO_FORK_SERVER";
inline constexpr const char socketName[] = "socket";
/// Of tools by their names.
inline constexpr const char toolsName[] = "tools";

/// What a fork server takes the launcher's connections from.
inline constexpr int launcherFile = 3;

inline constexpr size_t mostFiles = 64;
inline constexpr size_t longestName = 64;

/// At the beginning of the request's bytes; after it are the arguments and the
/// environment, each string with its zero.
struct Request {
  int32_t arguments, variables;
  int32_t group, mask;
  uint64_t ignoredSignals, blockedSignals;
  rlimit limits[RLIM_NLIMITS];
  /// The client's open files, and their numbers there.
  int32_t files;
  int32_t numbers[mostFiles];
};

/// Sends text and open files; false on an error.
inline bool send(int socket, const char *text, size_t size, const int *files,
                 size_t count) {
  iovec part{const_cast<char *>(text), size};
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int) * (mostFiles + 2))] = {};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control;
  message.msg_controllen = CMSG_SPACE(sizeof(int) * count);
  cmsghdr *header = CMSG_FIRSTHDR(&message);
  header->cmsg_level = SOL_SOCKET;
  header->cmsg_type = SCM_RIGHTS;
  header->cmsg_len = CMSG_LEN(sizeof(int) * count);
  auto *to = reinterpret_cast<int *>(CMSG_DATA(header));
  for (size_t i = 0; i < count; ++i)
    to[i] = files[i];
  return sendmsg(socket, &message, MSG_NOSIGNAL) == static_cast<ssize_t>(size);
}

/// How many files there were in the next message; negative without one.
inline int receive(int socket, int *files, size_t most) {
  char text[longestName];
  iovec part{text, sizeof text};
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int) * (mostFiles + 2))];
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control;
  message.msg_controllen = sizeof control;
  if (recvmsg(socket, &message, MSG_CMSG_CLOEXEC) <= 0)
    return -1;
  cmsghdr *header = CMSG_FIRSTHDR(&message);
  if (!header || header->cmsg_type != SCM_RIGHTS)
    return -1;
  size_t count = (header->cmsg_len - CMSG_LEN(0)) / sizeof(int);
  if (count > most)
    return -1;
  const auto *from = reinterpret_cast<const int *>(CMSG_DATA(header));
  for (size_t i = 0; i < count; ++i)
    files[i] = from[i];
  return static_cast<int>(count);
}

} // namespace piko::forks

#endif // PIKO_TEST_FORKSERVER_MESSAGES_H
