# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Runs a command whose standard error is a terminal; prints what came there, each
line by itself that wiped another one."""

import os
import pty
import subprocess
import sys

ours, theirs = pty.openpty()
process = subprocess.Popen(sys.argv[1:], stderr=theirs, stdout=subprocess.DEVNULL)
os.close(theirs)
said = b""
try:
    while part := os.read(ours, 4096):
        said += part
except OSError:  # how Linux says that nobody has the other end
    pass
said = said.decode().replace("\x1b[K", "<wiped>").replace("\r\n", "\n").replace("\r", "\n")
print(said)
sys.exit(process.wait())
