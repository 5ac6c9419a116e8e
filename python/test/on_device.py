# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""A pipeline on a CUDA device, with arrays that are there. test_arrays.py runs it on the
driver for tests, which its first argument names."""

import ctypes
import os
import sys

import numpy as np

import piko
from test_arrays import SUMS

POINTS = np.array([[1, 2, 3, 0], [4, 5, 6, 1], [7, 8, 9, 2]], "f4")


class Driver:
    """As another library uses a device: in its primary context."""

    def __init__(self, path):
        self.library = ctypes.CDLL(path)
        self.call("cuInit", ctypes.c_uint(0))
        context = ctypes.c_void_p()
        self.call("cuDevicePrimaryCtxRetain", ctypes.byref(context), ctypes.c_int(0))
        self.call("cuCtxSetCurrent", context)

    def call(self, name, *arguments):
        status = getattr(self.library, name)(*arguments)
        assert status == 0, (name, status)

    def copy_in(self, values):
        address, size = ctypes.c_uint64(), ctypes.c_size_t(values.nbytes)
        self.call("cuMemAlloc_v2", ctypes.byref(address), size)
        data = ctypes.c_void_p(values.ctypes.data)
        self.call("cuMemcpyHtoDAsync_v2", address, data, size, None)
        self.call("cuStreamSynchronize", None)
        return address.value

    def copy_out(self, address, values):
        data, size = ctypes.c_void_p(values.ctypes.data), ctypes.c_size_t(values.nbytes)
        self.call("cuMemcpyDtoHAsync_v2", data, ctypes.c_uint64(address), size, None)
        self.call("cuStreamSynchronize", None)


class Array:
    """An array of another library, in the device's memory."""

    def __init__(self, driver, values, strides=None, read_only=False):
        self.__cuda_array_interface__ = {
            "version": 3,
            "data": (driver.copy_in(values), read_only),
            "shape": values.shape,
            "strides": strides,
            "typestr": values.dtype.str,
        }
        if values.dtype.fields:
            self.__cuda_array_interface__["descr"] = values.dtype.descr


def expect(error, text, function, *arguments):
    try:
        function(*arguments)
    except error as caught:
        assert text in str(caught), caught
    else:
        raise AssertionError(f"expected {error}: {text}")


def check_runs(driver, pipe):
    assert pipe.device == 0
    assert pipe.allocate("sums", 3).tolist() == [0, 0, 0]
    pipe.feed("add", POINTS)
    pipe.run()
    first = pipe["sums"]
    assert first.tolist() == [7, 16, 25], first
    pipe.feed("add", Array(driver, POINTS * np.array((2, 2, 2, 1), "f4")))
    pipe["rows"] = Array(driver, np.full((1, 4), 2, "f4"))
    pipe.run()
    pipe.run(stream=0)  # in the order of the legacy stream
    assert pipe["sums"].tolist() == [14, 32, 50], pipe["sums"]
    assert pipe.read("sums").tolist() == [14, 32, 50]
    assert first.tolist() == [7, 16, 25], "a copy"
    expect(ValueError, "in the host's memory", piko.compare, pipe)


def check_results(driver, pipe):
    interface = pipe.device_array("sums").__cuda_array_interface__
    assert (interface["shape"], interface["strides"]) == ((3,), (4,)), interface
    assert interface["typestr"] == "<f4", interface
    copy = np.zeros(3, "f4")
    driver.copy_out(interface["data"][0], copy)
    assert copy.tolist() == [14, 32, 50], copy
    expect(piko.RunError, "bias", pipe.device_array, "bias")


def check_errors(driver, pipe):
    for value, text in (
        (Array(driver, POINTS.astype("f8")), "expected float32, but got float64"),
        (Array(driver, POINTS, strides=(32, 4)), "expected a contiguous array"),
        (Array(driver, np.zeros(3, [("a", "f4", 4)])), "expected (4,) of float32"),
    ):
        expect(ValueError, text, pipe.feed, "add", value)
    fixed = Array(driver, POINTS, read_only=True)
    expect(ValueError, "may be written", pipe.__setitem__, "rows", fixed)


def check_child(pipe):
    """The parent's context is not in the child."""
    child = os.fork()
    if child == 0:
        try:
            expect(RuntimeError, "parent process's; make it anew", pipe.run)
            os._exit(0)
        finally:
            os._exit(1)
    assert os.waitpid(child, 0)[1] == 0


def main():
    driver = Driver(sys.argv[1])
    (device,) = piko.devices()
    assert device.usable and device.memory > 0 and device.capability >= 70, device
    rows = np.ones((1, 4), "f4")
    pipe = piko.Pipeline(SUMS, target="cuda", opt_level=0, domain=(1, 1), rows=rows)
    check_runs(driver, pipe)
    check_results(driver, pipe)
    check_errors(driver, pipe)
    check_child(pipe)
    print("done")
