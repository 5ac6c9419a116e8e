// Bytes that lanes read in different places, and that piko-pair-gathers has not
// loaded one by one: the words that they lie in, shifted,
// where there are gathers; loads of one byte each where there are none, or where
// a sanitizer would tell of what lies after a buffer.
// REQUIRES: x86_64
// RUN: pikoc %s --emit=assembly --without=pair-gathers --cpu x86-64-v4 | FileCheck %s --check-prefix=WIDE
// RUN: pikoc %s --emit=assembly --without=pair-gathers --cpu x86-64-v3 | FileCheck %s --check-prefix=HALF
// RUN: pikoc %s --emit=assembly --without=pair-gathers --cpu x86-64-v4 --sanitize=address | FileCheck %s --check-prefix=ALONE
// WIDE-COUNT-2: vpgather{{[dq]}}d {{.*}}, %{{[yz]}}mm
// WIDE:         vpsrlvd %zmm
// WIDE-NOT:     vpinsrb
// HALF:         vpgather{{[dq]}}d
// HALF:         vpsrlvd %ymm
// HALF-NOT:     vpinsrb
// ALONE-NOT:    vpgather{{[dq]}}d
// ALONE:        __asan_report_load1

piko.record @B {"value" : i8 at 0} size 1 align 1
piko.record @V {"at" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @in : @B
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %n = piko.storage.unit_count %bins : !piko.bins<@V>
    scf.forall (%u) in (%n) {
      scf.for %x = %c0 to %n step %c1 {
        %i = arith.muli %x, %x : index
        %b = piko.load checked @in[%i : index] "value" : i8
        %w = arith.extui %b : i8 to i32
        %0 = arith.muli %w, %w : i32
        %1 = arith.addi %0, %w : i32
        %2 = arith.muli %1, %w : i32
        %3 = arith.xori %2, %w : i32
        %4 = arith.muli %3, %2 : i32
        piko.store %4, checked @out[%x : index] "at" : i32
      } {piko.lanes}
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@V>
  }
  piko.program {
    %in = piko.feed 0 : !piko.edge<@V>
    %bins = piko.join @a(concatenate %in) : (!piko.edge<@V>) -> !piko.bins<@V>
    piko.launch @k(%bins) : (!piko.bins<@V>) -> ()
  }
}
