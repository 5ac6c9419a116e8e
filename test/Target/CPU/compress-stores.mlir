// What few lanes have to do is compressed in registers, half of the lanes of 64
// bits at a time, and stored as far as there are some. A processor without the
// instruction takes lane after lane.
// REQUIRES: x86_64
// RUN: pikoc %s --emit=assembly --cpu x86-64-v4 | FileCheck %s
// RUN: pikoc %s --emit=assembly --cpu x86-64-v3 | FileCheck %s --check-prefix=TURNS
// CHECK-NOT:     vpcompress{{.*}}(%
// CHECK:         vpcompressd %zmm{{.*}}, %zmm
// CHECK:         vmovdqu32 %zmm{{.*}}) {%k
// CHECK-COUNT-2: vpcompressq %zmm{{.*}}, %zmm
// CHECK-NOT:     vpcompress
// TURNS-NOT:     vpcompress
// TURNS:         tzcnt

piko.record @B {"w" : i32 at 0, "v" : i32 at 4} size 8 align 4
piko.record @N {"n" : i64 at 0} size 8 align 8
piko.pipeline @P rank 1 {
  piko.buffer @sums : @N
  piko.source @a
  piko.stage @a bins [0] threads 1 : @B -> [] {
    piko.schedule load_balance lanes items
  }
  piko.kernel @k {
    %c0 = arith.constant 0 : i32
    %c1 = arith.constant 1 : i32
    %step = arith.constant 1 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@B>
    %n = piko.storage.unit_count %bins : !piko.bins<@B>
    scf.forall (%u) in (%n) {
      %writer = piko.cpu.open_writer %bins[%u] : !piko.bins<@B>
      %copy = piko.cpu.private_copy max_unsigned @sums "n" of %writer often
      %begin, %end = piko.storage.unit_buckets %bins[%u] : !piko.bins<@B>
      scf.for %cell = %begin to %end step %step {
        %lo, %hi = piko.storage.bucket_range %bins[%u, %cell] : !piko.bins<@B>
        scf.for %i = %lo to %hi step %step {
          %b = piko.storage.item %bins[%i] : !piko.bins<@B> -> !piko.prim<@B>
          %w = piko.get %b "w" : !piko.prim<@B> -> i32
          %v = piko.get %b "v" : !piko.prim<@B> -> i32
          %columns = scf.while (%x = %c0) : (i32) -> i32 {
            %more = arith.cmpi slt, %x, %w : i32
            scf.condition(%more) %x : i32
          } do {
          ^bb0(%x: i32):
            %sum = arith.muli %x, %v : i32
            %key = arith.extui %sum : i32 to i64
            %is_odd = arith.cmpi sgt, %sum, %c1 : i32
            scf.if %is_odd {
              piko.atomic max_unsigned checked @sums[%x : i32] "n", %key in %copy : i64
            }
            %next = arith.addi %x, %c1 : i32
            scf.yield %next : i32
          }
        } {piko.lanes, piko.mapping = #piko<lanes items>}
      }
      piko.cpu.close_writer %writer
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@B>
  }
  piko.program {
    %in = piko.feed 0 : !piko.edge<@B>
    %bins = piko.join @a(concatenate %in) : (!piko.edge<@B>) -> !piko.bins<@B>
    piko.launch @k(%bins) : (!piko.bins<@B>) -> ()
  }
}
