#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Runs the cases of test/EndToEnd on a card, beside the reference executor.

  cases.py RESULTS.jsonl SECONDS [option of piko-compare..]

A line of JSON for each command: what it was, its status and output. Prints those that
did not end as the test wants it, and how many did.
"""

import concurrent.futures
import json
import os
import pathlib
import re
import subprocess
import sys
import time

ROOT = pathlib.Path(os.environ["PIKO_KIT_ROOT"])
FILES = ROOT / "test" / "EndToEnd"
TOOL = "/opt/piko-kit/bin/piko-compare"


def read_command(file, line):
    """Words, and whether it is to fail; or None where the line is none for a card."""
    found = re.search(r"RUN: *(.*)", line)
    if not found:
        return None
    text = re.sub(r"^%if \w+ %\{ *(.*) %\}$", r"\1", found[1])
    text = text.split(" | ")[0].split(" > ")[0].split(" 2>")[0]
    fails = "not piko-compare" in text or "--stops" in text
    text = re.sub(r"^env ", "", text)
    text = re.sub(r"PIKO_[A-Z_]+=\S+ ", "", text).replace("not piko-compare",
                                                          "piko-compare")
    text = text.replace("%compare_targets", "piko-compare --target cuda")
    if not text.startswith("piko-compare") or "--target cuda" not in text:
        return None
    for name, value in {"%{gpu}": "--runs 1", "%s": file, "%S": FILES,
                        "%examples": ROOT / "examples"}.items():
        text = text.replace(name, str(value))
    if "%" in text:  # of files that the test makes
        return None
    words = [word for word in re.sub(r"--threads( \d+)+", "", text).split()
             if word != "--stops"]
    return [TOOL, *words[1:], "--threads", "2", "--timeout", "100"], fails


def run(job):
    words, _ = job
    start = time.time()
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    return job, done.returncode, done.stdout + done.stderr, time.time() - start


def main():
    results, seconds, extra = sys.argv[1], float(sys.argv[2]), sys.argv[3:]
    jobs = []
    for file in sorted([*FILES.glob("*.cpp"), *FILES.glob("*.test")]):
        for line in file.read_text().splitlines():
            if command := read_command(file, line):
                jobs.append((command[0] + extra, command[1]))
    done = bad = cases = 0
    pool = concurrent.futures.ThreadPoolExecutor(max(1, (os.cpu_count() or 1) - 1))
    futures = [pool.submit(run, job) for job in jobs]
    with open(results, "w", encoding="utf-8") as log:
        try:
            for future in concurrent.futures.as_completed(futures, timeout=seconds):
                (words, fails), status, text, took = future.result()
                done += 1
                cases += len(re.findall(r"^equal", text, re.M))
                log.write(json.dumps({"command": words, "fails": fails,
                                      "status": status, "seconds": round(took, 2),
                                      "text": text[-6000:]}) + "\n")
                log.flush()
                if status not in (0, 1) or (status != 0) != fails:
                    bad += 1
                    told = [it for it in text.splitlines() if it != "equal"][:5]
                    print(f"status {status}: {' '.join(words[1:])}",
                          *(f"  {it[:250]}" for it in told), sep="\n", flush=True)
        except concurrent.futures.TimeoutError:
            print("time is up")
    print(f"{done} of {len(jobs)} commands, {cases} cases equal, {bad} commands not "
          "as expected", flush=True)
    os._exit(1 if bad or done < len(jobs) else 0)


if __name__ == "__main__":
    main()
