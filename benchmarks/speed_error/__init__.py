# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Speed against error: what speed-error.py is made of."""
