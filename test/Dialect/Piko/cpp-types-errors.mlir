// RUN: piko-opt %s --split-input-file --verify-diagnostics

// expected-error@+1 {{expected 'piko.cpp_types' to be a dictionary, but got "bool"}}
piko.record @R {"x" : i8 at 0} size 8 align 4
  {piko.cpp_types = "bool"}

// -----

// expected-error@+1 {{expected 'piko.cpp_types' to name a field, a class around fields or 'this', but got 'y'}}
piko.record @R {"x" : i8 at 0} size 8 align 4
  {piko.cpp_types = {y = "bool"}}

// -----

// expected-error@+1 {{expected the C++ type of 'x' to be a name with extents of at least 1, or a dictionary with one as its 'type', but got 3 : i64}}
piko.record @R {"x" : i8 at 0} size 8 align 4
  {piko.cpp_types = {x = 3}}

// -----

// expected-error@+1 {{expected the C++ type of 'x' to be a name with extents of at least 1, or a dictionary with one as its 'type', but got "bool[0]"}}
piko.record @R {"x" : i8 at 0} size 8 align 4
  {piko.cpp_types = {x = "bool[0]"}}

// -----

// expected-error@+1 {{expected the C++ type of 'x' to be a name with extents of at least 1, or a dictionary with one as its 'type', but got {underlying = "uint8_t"}}}
piko.record @R {"x" : i8 at 0} size 8 align 4
  {piko.cpp_types = {x = {underlying = "uint8_t"}}}

// -----

// expected-error@+1 {{expected the C++ type of 'x' to be kept in 'i8', but got 'uint32_t'}}
piko.record @R {"x" : i8 at 0} size 8 align 4
  {piko.cpp_types = {x = "uint32_t"}}

// -----

// expected-error@+1 {{expected the C++ type of 'x' to be kept in 'f32', but got 'uint32_t'}}
piko.record @R {"x" : f32 at 0} size 8 align 4
  {piko.cpp_types = {x = {type = "E", underlying = "uint32_t"}}}

// -----

// expected-error@+1 {{expected the C++ type of 'x' to be a number, or an enumeration with a number as its 'underlying', but got 'Kind'}}
piko.record @R {"x" : i8 at 0} size 8 align 4
  {piko.cpp_types = {x = "Kind"}}

// -----

// expected-error@+1 {{expected the C++ type of 'x' to be an enumeration whose 'values' are integers, but got 1.000000e+00 : f64 for 'A'}}
piko.record @R {"x" : i8 at 0} size 8 align 4
  {piko.cpp_types = {x = {type = "E", underlying = "uint8_t", values = {A = 1.0}}}}

// -----

// expected-error@+1 {{expected the C++ type of 'p' to be a class, but got "float"}}
piko.record @R {"p.x" : f32 at 0} size 8 align 4
  {piko.cpp_types = {p = "float"}}

// -----

// expected-error@+1 {{expected the C++ type of 'this' to be no array, but got "P[2]"}}
piko.record @R {"p.x" : f32 at 0} size 8 align 4
  {piko.cpp_types = {this = "P[2]"}}

// -----

// expected-error@+1 {{expected the C++ type of 'p' to be a class with a power of two as its 'align', that divides its 'size', but got 3 and 6}}
piko.record @R {"p.x" : f32 at 0} size 8 align 4
  {piko.cpp_types = {p = {type = "P", size = 6, align = 3}}}

// -----

// expected-error@+1 {{expected the C++ type of 'p' to be a class with a power of two as its 'align', that divides its 'size', but got 0 and 8}}
piko.record @R {"p.x" : f32 at 0} size 8 align 4
  {piko.cpp_types = {p = {type = "P", size = 8}}}

// -----

// expected-error@+1 {{expected the extents of 'x' to be those of field 'x', [2], but got [3]}}
piko.record @R {"x" : i8[2 : 1] at 0} size 8 align 4
  {piko.cpp_types = {x = "bool[3]"}}

// -----

// expected-error@+1 {{expected the extents of 'x' to be those of field 'x', [2], but got []}}
piko.record @R {"x" : i8[2 : 1] at 0} size 8 align 4
  {piko.cpp_types = {x = "bool"}}

// -----

// expected-error@+1 {{expected the extents of 'p' to be those of field 'p.x', [2], but got [2, 2]}}
piko.record @R {"p.x" : i8[2 : 1] at 0} size 8 align 4
  {piko.cpp_types = {p = "P[2][2]"}}

// -----

// expected-error@+1 {{expected the extents of 'p.x' to be those of field 'p.x', [2, 3], but got [2]}}
piko.record @R {"p.x" : i8[2 : 3, 3 : 1] at 0} size 8 align 4
  {piko.cpp_types = {p = "P[2]", p.x = "bool[2]"}}

// -----

// expected-error@+1 {{expected 'glm::vec3' for 3 numbers of type 'float', but got 2 of type 'f32' in 'p'}}
piko.record @R {"p.x" : f32 at 0, "p.y" : f32 at 4} size 8 align 4
  {piko.cpp_types = {p = "glm::vec3"}}

// -----

// expected-error@+1 {{expected 'glm::uvec2' for 2 numbers of type 'uint32_t', but got 2 of type 'f32' in 'this'}}
piko.record @R {"x" : f32 at 0, "y" : f32 at 4} size 8 align 4
  {piko.cpp_types = {this = "glm::uvec2"}}

// -----

// expected-error@+1 {{expected 'glm::vec<2, int8_t>' for 2 numbers of type 'int8_t', but got 1 of type 'i8' in 'p'}}
piko.record @R {"p.x" : i8 at 0} size 8 align 4
  {piko.cpp_types = {p = "glm::vec<2, int8_t>"}}

// -----

// expected-error@+1 {{expected 'glm::sphere' to be a vector, a matrix or a quaternion of GLM}}
piko.record @R {"p.x" : i8 at 0} size 8 align 4
  {piko.cpp_types = {p = "glm::sphere"}}
