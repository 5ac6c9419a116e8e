// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Qt beside a pipeline: its headers parse, its inline vectors compile.
// REQUIRES: all
// RUN: piko-translate --cpp-to-piko -DQT_NO_KEYWORDS -I%qt_include %s 2>&1 | FileCheck %s
// RUN: not piko-translate --cpp-to-piko -I%qt_include %s 2>&1 | FileCheck %s --check-prefix=KEYWORDS
#include <QtConcurrent/QtConcurrent>
#include <QtCore/QtCore>
#include <QtGui/QtGui>
#include <QtNetwork/QtNetwork>
#include <QtWidgets/QtWidgets>
// KEYWORDS: error: {{.*}}a macro called 'emit' hides a function of Piko: with Qt, define QT_NO_KEYWORDS
#include <piko.h>

struct Point {
  float x, y, z;
};

// CHECK-NOT: error
// CHECK-LABEL: piko.stage @turn
struct Turn : piko::Stage<0, 0, 1, Point, Point> {
  void process(const Point &p) {
    QVector3D v(p.x, p.y, p.z);
    v = 2 * v + QVector3D(QPointF(1, 2));
    // CHECK: arith.mulf
    // CHECK: piko.emit
    emit(Point{v.x(), v.y(), v.z()});
  }
};
struct Drain : piko::Stage<0, 0, 1, Point> {
  void process(const Point &) {}
};
struct Pipeline : piko::Pipe<> {
  Turn turn;
  Drain drain;
  Pipeline() {
    source(turn);
    connect(turn, 0, drain);
  }
};
