# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

# cmake -DTEXT=FILE -DHEADER=NAME -DVARIABLE=NAME -DOUT=FILE -P EmbedText.cmake
# A source file that defines a variable of a header as a file's text.
file(READ ${TEXT} text)
file(WRITE ${OUT} "#include \"${HEADER}\"\n\n"
  "const char *const ${VARIABLE} = R\"TEXT(${text})TEXT\";\n")
