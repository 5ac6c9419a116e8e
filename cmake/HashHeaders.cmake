# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

# cmake -D OUT=FILE -D SALT=TEXT -P HashHeaders.cmake FILE...
# A file with a hash of files and of a text.
set(hashes "${SALT}")
math(EXPR last "${CMAKE_ARGC} - 1")
foreach(index RANGE 7 ${last})
  file(SHA256 ${CMAKE_ARGV${index}} hash)
  string(APPEND hashes " ${hash}")
endforeach()
string(SHA256 hash "${hashes}")
file(WRITE ${OUT} "${hash}\n")
