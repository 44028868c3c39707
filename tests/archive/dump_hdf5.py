"""Prints a whole HDF5 file as JSON, as h5py reads it: {"attributes": {...}, "datasets": {path: {"data", "unit",
"labels"}}}. Floating-point numbers come as hexadecimal texts, so that every bit and NaN get through."""
import json
import sys

import h5py
import numpy


def plain(x):
    if isinstance(x, bytes):
        return x.decode()
    if isinstance(x, (float, numpy.floating)):
        return float(x).hex()
    if isinstance(x, (int, numpy.integer)):
        return int(x)
    if isinstance(x, numpy.ndarray):
        return [plain(y) for y in x]
    return str(x)


datasets = {}


def take(path, item):
    if not isinstance(item, h5py.Dataset):
        return
    labels = h5py.check_enum_dtype(item.dtype) or {}
    by_number = [name for name, _ in sorted(labels.items(), key=lambda one: one[1])]
    datasets[path] = {"data": plain(item[()]), "unit": plain(item.attrs.get("unit", "")), "labels": by_number}


with h5py.File(sys.argv[1], "r") as file:
    file.visititems(take)
    json.dump({"attributes": {name: plain(x) for name, x in file.attrs.items()}, "datasets": datasets}, sys.stdout)
