// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Macros of X11's and Windows's headers that are called as a name might be. None
// of them stands for anything that compiles.
// X11
#define Above @
#define AllTemporary @
#define Always @
#define AnyKey @
#define BadValue @
#define Below @
#define Bool @
#define Button1 @
#define ButtonPress @
#define CapRound @
#define ClientMessage @
#define Complex @
#define Convex @
#define CurrentTime @
#define DirectColor @
#define Expose @
#define False @
#define FillSolid @
#define FocusIn @
#define FocusOut @
#define GrayScale @
#define InputOnly @
#define JoinRound @
#define KeyPress @
#define KeyRelease @
#define LineSolid @
#define MapNotify @
#define NoSymbol @
#define NoValue @
#define None @
#define Nonconvex @
#define Opposite @
#define PointerRoot @
#define PSize @
#define Status @
#define StaticColor @
#define Success @
#define SyncBoth @
#define True @
#define TrueColor @
#define Unsorted @
#define WhenMapped @
#define YSorted @
#define ZPixmap @
// Windows
#define ABSOLUTE @
#define CALLBACK @
#define CONST @
#define DELETE @
#define DIFFERENCE @
#define DOMAIN @
#define ERROR @
#define FAR @
#define IGNORE @
#define IN @
#define INFINITE @
#define NEAR @
#define NO_ERROR @
#define OPAQUE @
#define OPTIONAL @
#define OUT @
#define OVERFLOW @
#define PLANES @
#define RELATIVE @
#define STRICT @
#define TEXT @
#define THIS @
#define TRANSPARENT @
#define UNDERFLOW @
#define VOID @
#define Yield @
#define cdecl @
#define chx1 @
#define far @
#define hyper @
#define interface @
#define near @
#define pascal @
#define rad1 @
#define small @
#define min(a, b) @
#define max(a, b) @
// Qt, but for emit, of which piko.h says what to do
#define foreach @
#define forever @
#define signals @
#define slots @
