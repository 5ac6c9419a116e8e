# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""What a frame would take of a GPU, from what was counted of it."""
