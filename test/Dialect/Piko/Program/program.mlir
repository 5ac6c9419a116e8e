// RUN: piko-opt %s | piko-opt | FileCheck %s

piko.record @F {"x" : i32 at 0} size 4 align 4

// Strips, a schedule, a merge by key, and a wait.
// CHECK-LABEL: piko.pipeline @Lines
piko.pipeline @Lines rank 1 {
  piko.image @count : @F rank 1
  piko.source @start
  piko.source @meet
  piko.edge @start[0] -> @meet
  piko.edge @meet[0] -> @last
  piko.stage @start bins [8] threads 1 : @F -> [@F] {}
  piko.stage @meet bins [0] threads 1 : @F -> [@F] {
    piko.schedule load_balance end_stage [@start]
  }
  piko.stage @last bins [0] threads 1 : @F -> [] {
    piko.schedule serialize end_stage [@meet] dynamic {
    ^bb0(%bin: index):
      piko.return
    }
  }
  piko.kernel @assign_start {
    piko.assign of @start source 0 {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
  }
  piko.kernel @kernel_start {
    piko.process of @start {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.kernel @kernel_meet {
    piko.process of @meet {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.kernel @kernel_last {
    piko.process of @last {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  // CHECK: piko.program roots [@meet] {
  piko.program roots [@meet] {
    // CHECK-NEXT: piko.clear @count
    piko.clear @count
    // CHECK-NEXT: piko.schedule_bins @last
    piko.schedule_bins @last
    // CHECK-NEXT: %[[A:.*]] = piko.feed 0 : !piko.edge<@F>
    %a = piko.feed 0 : !piko.edge<@F>
    // CHECK-NEXT: %[[S:.*]] = piko.strips(%[[A]]) chunk 16 {
    %s = piko.strips(%a) chunk 16 {
    // CHECK-NEXT: ^bb0(%[[PART:.*]]: !piko.edge<@F>):
    ^bb0(%part: !piko.edge<@F>):
      // CHECK-NEXT: %[[PLACED:.*]] = piko.launch @assign_start(%[[PART]]) : (!piko.edge<@F>) -> !piko.edge<@F>
      %placed = piko.launch @assign_start(%part) : (!piko.edge<@F>) -> !piko.edge<@F>
      // CHECK-NEXT: %[[BINS:.*]] = piko.join @start(concatenate %[[PLACED]] keys 1) keeps 1 : (!piko.edge<@F>) -> !piko.bins<@F>
      %bins = piko.join @start(concatenate %placed keys 1) keeps 1 : (!piko.edge<@F>) -> !piko.bins<@F>
      // CHECK-NEXT: %[[OUT:.*]] = piko.launch @kernel_start(%[[BINS]]) : (!piko.bins<@F>) -> !piko.edge<@F>
      %out = piko.launch @kernel_start(%bins) : (!piko.bins<@F>) -> !piko.edge<@F>
      // CHECK-NEXT: piko.leave %[[OUT]] : !piko.edge<@F>
      piko.leave %out : !piko.edge<@F>
    // CHECK-NEXT: } : (!piko.edge<@F>) -> !piko.edge<@F>
    } : (!piko.edge<@F>) -> !piko.edge<@F>
    // CHECK-NEXT: %[[B:.*]] = piko.feed 1
    %b = piko.feed 1 : !piko.edge<@F>
    // CHECK-NEXT: piko.join @meet merge(permute %[[S]] keys 2, concatenate %[[B]] keys 1)
    %both = piko.join @meet merge(permute %s keys 2, concatenate %b keys 1) : (!piko.edge<@F>, !piko.edge<@F>) -> !piko.bins<@F>
    %met = piko.launch @kernel_meet(%both) : (!piko.bins<@F>) -> !piko.edge<@F>
    // CHECK: piko.wait @meet
    piko.wait @meet
    %rest = piko.join @last(concatenate %met) : (!piko.edge<@F>) -> !piko.bins<@F>
    // CHECK: piko.launch @kernel_last(%{{.*}}) : (!piko.bins<@F>) -> ()
    piko.launch @kernel_last(%rest) : (!piko.bins<@F>) -> ()
  }
}

// Rounds, in each of which waves run until nothing is left.
// CHECK-LABEL: piko.pipeline @Cycles
piko.pipeline @Cycles rank 1 {
  piko.source @grow
  piko.edge @grow[0] -> @grow
  piko.edge @grow[1] -> @list
  piko.edge @list[0] -> @grow
  piko.edge @list[1] -> @last
  piko.stage @grow bins [0] threads 1 : @F -> [@F, @F] {}
  piko.stage @list bins [0] threads 1 : list @F -> [@F, @F] {}
  piko.stage @last bins [0] threads 1 : @F -> [] {}
  piko.kernel @kernel_grow {
    piko.process of @grow {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.kernel @kernel_list {
    piko.process of @list {
    ^bb0(%l: !piko.list<@F>):
      piko.return
    }
  }
  piko.kernel @kernel_last {
    piko.process of @last {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.program roots [@list] {
    %in = piko.feed 0 : !piko.edge<@F>
    // CHECK: %[[ROUNDS:.*]] = piko.rounds(%{{.*}}) {
    // CHECK-NEXT: ^bb0(%[[FIRST:.*]]: !piko.edge<@F>, %[[AGAIN:.*]]: !piko.edge<@F>):
    %out = piko.rounds(%in) {
    ^bb0(%first: !piko.edge<@F>, %again: !piko.edge<@F>):
      // CHECK-NEXT: %[[GROWN:.*]] = piko.waves(%[[FIRST]], %[[AGAIN]]) keys 2 {
      // CHECK-NEXT: ^bb0(%[[A:.*]]: !piko.edge<@F>, %[[B:.*]]: !piko.edge<@F>, %[[C:.*]]: !piko.edge<@F>):
      %grown = piko.waves(%first, %again) keys 2 {
      ^bb0(%a: !piko.edge<@F>, %b: !piko.edge<@F>, %c: !piko.edge<@F>):
        // CHECK-NEXT: piko.join @grow merge(concatenate %[[A]] keys 1, concatenate %[[B]] keys 2, concatenate %[[C]])
        %bins = piko.join @grow merge(concatenate %a keys 1, concatenate %b keys 2, concatenate %c) : (!piko.edge<@F>, !piko.edge<@F>, !piko.edge<@F>) -> !piko.bins<@F>
        // CHECK-NEXT: %[[G:.*]]:2 = piko.launch @kernel_grow
        %g:2 = piko.launch @kernel_grow(%bins) : (!piko.bins<@F>) -> (!piko.edge<@F>, !piko.edge<@F>)
        // CHECK-NEXT: piko.leave %[[G]]#1 : !piko.edge<@F> again %[[G]]#0 : !piko.edge<@F>
        piko.leave %g#1 : !piko.edge<@F> again %g#0 : !piko.edge<@F>
      } : (!piko.edge<@F>, !piko.edge<@F>) -> !piko.edge<@F>
      %all = piko.join @list(concatenate %grown) : (!piko.edge<@F>) -> !piko.bins<@F>
      // CHECK: piko.launch @kernel_list(%{{.*}}) turn 0
      %l:2 = piko.launch @kernel_list(%all) turn 0 : (!piko.bins<@F>) -> (!piko.edge<@F>, !piko.edge<@F>)
      piko.leave %l#1 : !piko.edge<@F> again %l#0 : !piko.edge<@F>
    } : (!piko.edge<@F>) -> !piko.edge<@F>
    %done = piko.join @last(concatenate %out) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @kernel_last(%done) : (!piko.bins<@F>) -> ()
  }
}
