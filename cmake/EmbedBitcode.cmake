# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

# cmake -DBITCODE=FILE -DVARIABLE=NAME -DOUT=FILE -P EmbedBitcode.cmake
# A source file that defines a StringRef, NAME, of a file's bytes.
file(READ ${BITCODE} bytes HEX)
string(REGEX REPLACE "(..)" "\\\\x\\1" bytes "${bytes}")
# A compiler need not take lines of any length.
string(REGEX REPLACE "(................................................................)" "\\1\"\n\"" bytes "${bytes}")
file(WRITE ${OUT} "#include \"llvm/ADT/StringRef.h\"\n\n"
  "static const char ${VARIABLE}Bytes[] =\n\"${bytes}\";\n"
  "extern const llvm::StringRef ${VARIABLE};\n"
  "const llvm::StringRef ${VARIABLE}(${VARIABLE}Bytes, sizeof ${VARIABLE}Bytes - 1);\n")
