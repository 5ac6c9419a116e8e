// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// In checking mode an endless loop names the whole way of a primitive that stays
// in it, whichever thread's memory that one lies in.
// REQUIRES: all
// HOLE: cuda: what is checked is written down on the host
// RUN: %compare_checked %s --stops --count 40000 --domain 67 35 --loop-limit 6 --runs 1 --threads 3 --check | FileCheck %s
// CHECK: got: stage 'travel', bin 11: a loop did not end within 6 hops
// CHECK-NEXT: lineage: source 0 primitive 30000, 'depart' bin 0 emit 0, 'travel' bin 31 emit 0,
#include <piko.h>

struct Particle {
  int x, y;
  float value;
  int serial;
};
struct Traveller {
  int x, y, serial, hops;
  float freight[8];
};
struct State {
  piko::Buffer<int> arrivals;
};

struct Depart : piko::Stage<0, 0, 64, Particle, Traveller> {
  void process(const Particle &p) { emit({p.x, p.y, p.serial, 0, {}}); }
};

// From bin to bin; one part of all never arrives.
struct Travel : piko::Stage<8, 8, 64, Traveller, Traveller, Traveller> {
  void assignBin(const Traveller &t) {
    assignToBin(t, binFromPosition(
                       glm::ivec2(int(uint32_t(t.x) % uint32_t(domain().x)),
                                  int(uint32_t(t.y) % uint32_t(domain().y)))));
  }
  void process(const Traveller &t) {
    if (t.hops > 3 && t.serial < 30000)
      return emit(t, 1);
    Traveller next = t;
    next.x += 7;
    next.y += 3;
    ++next.hops;
    emit(next, 0);
  }
};

struct Arrive : piko::Stage<0, 0, 64, Traveller>, piko::Uses<State> {
  void process(const Traveller &t) {
    piko::atomicAdd(state().arrivals[t.serial], t.hops);
  }
};

struct Journey : piko::Pipe<State> {
  Depart depart;
  Travel travel;
  Arrive arrive;
  Journey() {
    source(depart);
    connect(depart, 0, travel);
    connect(travel, 0, travel);
    connect(travel, 1, arrive);
    allocateForSource(state().arrivals, 0);
  }
};
