//===- GltfUri.cpp - What URIs in glTF files hold -------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Bytes.h"
#include "GltfFile.h"

using namespace piko;
using namespace piko::render;

namespace {

int valueOfBase64(char c) {
  if (c >= 'A' && c <= 'Z')
    return c - 'A';
  if (c >= 'a' && c <= 'z')
    return c - 'a' + 26;
  if (c >= '0' && c <= '9')
    return c - '0' + 52;
  if (c == '+' || c == '-')
    return 62;
  return c == '/' || c == '_' ? 63 : -1;
}

Result<std::string> decodeBase64(std::string_view text) {
  while (text.ends_with('='))
    text.remove_suffix(1);
  std::string bytes;
  bytes.reserve(text.size() / 4 * 3 + 3);
  uint32_t bits = 0;
  int length = 0;
  for (char c : text) {
    if (isBlank(c))
      continue;
    int value = valueOfBase64(c);
    if (value < 0)
      return Error{"expected base64, but got " + quoteWord({&c, 1})};
    bits = bits << 6 | uint32_t(value);
    length += 6;
    if (length >= 8) {
      length -= 8;
      bytes += char(bits >> length & 0xff);
    }
  }
  return bytes;
}

int valueOfHex(char c) {
  if (c >= '0' && c <= '9')
    return c - '0';
  c = char(c | 32);
  return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

} // namespace

std::string render::decodePercents(std::string_view text) {
  std::string decoded;
  for (size_t i = 0; i < text.size(); ++i) {
    int high = -1, low = -1;
    if (text[i] == '%' && text.size() - i > 2) {
      high = valueOfHex(text[i + 1]);
      low = valueOfHex(text[i + 2]);
    }
    bool isCode = high >= 0 && low >= 0;
    decoded += isCode ? char(high * 16 + low) : text[i];
    i += isCode ? 2 : 0;
  }
  return decoded;
}

Result<std::string> render::decodeDataUri(std::string_view uri) {
  size_t comma = uri.find(',');
  if (comma == uri.npos)
    return Error{"expected a comma in a data URI"};
  std::string content = decodePercents(uri.substr(comma + 1));
  if (!uri.substr(0, comma).ends_with(";base64"))
    return content;
  return decodeBase64(content);
}
