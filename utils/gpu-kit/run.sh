#!/bin/bash
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#
# On a machine with a card, in the folder that make.py's file was unpacked to:
#
#   ./run.sh                      all steps, in at most eight minutes
#   ./run.sh --seconds 100        those that fit, the most valuable first
#   ./run.sh --from time          what is left from there on
#   ./run.sh --peer COMMAND       beside another renderer; ./run.sh --help says more
#
# Results come into results.jsonl, a line of JSON for each thing done: that file is
# what to bring back.
here="$(cd "$(dirname "$0")" && pwd)"
exec python3 "$here/steps.py" "$@"
