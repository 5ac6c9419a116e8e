# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

# cmake -DPTX=FILE -DCUBINS=CHIP=FILE,... -DHEADER=NAME -DVARIABLE=NAME -DOUT=FILE
#   -P EmbedKernels.cmake
# A source file that defines a variable of a header as images for a CUDA device: a
# file's PTX, and cubins.
file(READ ${PTX} text)
string(MAKE_C_IDENTIFIER "${VARIABLE}" symbol)
set(bytes "")
set(declarations "")
set(images "")
string(REPLACE "," ";" cubins "${CUBINS}")
foreach(cubin IN LISTS cubins)
  string(REGEX MATCH "^([0-9]+)=(.*)$" matched "${cubin}")
  set(name ${symbol}_${CMAKE_MATCH_1})
  string(APPEND bytes ".balign 64\\n.globl ${name}\\n.hidden ${name}\\n${name}:\\n.incbin \\\"${CMAKE_MATCH_2}\\\"\\n")
  string(APPEND declarations
    "extern \"C\" __attribute__((visibility(\"hidden\"))) const char ${name}[];\n")
  string(APPEND images "    {${CMAKE_MATCH_1}, 0, ${name}},\n")
endforeach()
file(WRITE ${OUT} "#include \"${HEADER}\"\n\n")
if(cubins)
  file(APPEND ${OUT}
    "asm(\".pushsection .rodata\\n${bytes}.popsection\\n\");\n${declarations}")
endif()
file(APPEND ${OUT} "static const char ptx[] = R\"TEXT(${text})TEXT\";\n"
  "const pikoir_cuda_image ${VARIABLE}[] = {\n${images}"
  "    {0, 0, ptx},\n    {0, 0, nullptr}};\n")
