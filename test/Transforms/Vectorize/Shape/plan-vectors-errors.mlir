// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors{lanes=12}))' --verify-diagnostics %s

// expected-error@+1 {{expected 4, 8 or 16 lanes, but got 12}}
piko.pipeline @P rank 1 {
}
