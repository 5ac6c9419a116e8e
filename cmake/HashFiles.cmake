# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

# cmake -DOUT=FILE -P HashFiles.cmake HEADER VARIABLE FILE...
# A source file that defines a variable of a header as a hash of files.
set(hashes "")
math(EXPR last "${CMAKE_ARGC} - 1")
foreach(index RANGE 6 ${last})
  file(SHA256 ${CMAKE_ARGV${index}} hash)
  string(APPEND hashes ${hash})
endforeach()
string(SHA256 hash "${hashes}")
file(WRITE ${OUT} "#include \"${CMAKE_ARGV4}\"\n\n"
  "const char *const ${CMAKE_ARGV5} = \"${hash}\";\n")
