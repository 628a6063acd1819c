"""Writes the small Arrow files in tests/data and the seeds in fuzz/corpus/arrow.

Needs pyarrow, pandas and polars. Run: python tests/make_arrow.py
"""

import decimal
import pathlib

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
from pyarrow import feather, ipc

here = pathlib.Path(__file__).parent
data, corpus = here / "data", here / "../../../fuzz/corpus/arrow"
corpus.mkdir(parents=True, exist_ok=True)
N = 60
n = np.arange(N)
moments = np.datetime64("2024-05-06T07:08:09.25", "ns") + n * np.timedelta64(200, "us")


def gaps(values):
    return [None if k % 7 == 3 else value for k, value in enumerate(values)]


def save(name, table, folder=data, rows=None, stream=False, **options):
    """Record batches of `rows` rows, all in one without."""
    new = ipc.new_stream if stream else ipc.new_file
    with new(folder / f"{name}.arrow", table.schema, options=ipc.IpcWriteOptions(**options)) as writer:
        writer.write_table(table, max_chunksize=rows)


whole = {
    f"{sign}{bits}": pa.array(
        gaps((n % 50).tolist()) if bits == 16 else n - (30 if sign == "i" else 0),
        pa.type_for_alias(f"{'u' * (sign == 'u')}int{bits}"),
    )
    for sign in "iu"
    for bits in (8, 16, 32, 64)
}
columns = whole | {
    "f16": pa.array((n / 8).astype("f2")),
    "f32": pa.array((n * 0.1).astype("f4")),
    "f64": pa.array(n * 0.1),
    "truth": pa.array(n % 3 == 0),
    "maybe": pa.array(gaps([bool(k % 3 == 0) for k in n])),
    "gaps": pa.array(gaps((n / 4).tolist())),
    "single": pa.array(gaps((n / 4).tolist()), pa.float32()),
    "decimal": pa.array([decimal.Decimal(int(k) - 30) / 100 for k in n], pa.decimal128(9, 2)),
    "clock": pa.array((n * 1000).astype("i4"), pa.time32("ms")),
    "inner": pa.StructArray.from_arrays(
        [pa.array(n * 0.5), pa.array(gaps(n.tolist()))], ["x", "y"], mask=pa.array(n % 10 == 9)
    ),
}
# columns that are none, each with its own number of buffers, and one of numbers behind them all
codes = pa.array((n % 3).astype("i1"))
others = {
    "text": pa.array([f"a{k}" for k in n]),
    "views": pa.array([f"a text of more than twelve letters {k}" for k in n], pa.string_view()),
    "long_text": pa.array([f"a{k}" for k in n], pa.large_string()),
    "bytes": pa.array([b"ab"] * N, pa.binary(2)),
    "lists": pa.array([[1, 2]] * N),
    "pairs": pa.array([[1, 2]] * N, pa.list_(pa.int8(), 2)),
    "map": pa.array([[("a", 1.0)]] * N, pa.map_(pa.string(), pa.float64())),
    "list_view": pa.array([[1, 2]] * N, pa.list_view(pa.int16())),
    "nothing": pa.nulls(N),
    "category": pa.array([f"a{k % 3}" for k in n]).dictionary_encode(),
    "day": pa.array(n.astype("i4"), pa.date32()),
    "sparse": pa.UnionArray.from_sparse(codes, [pa.array(n), pa.array(n * 0.5), pa.array(n % 2 == 0)]),
    "dense": pa.UnionArray.from_dense(
        codes, pa.array((n // 3).astype("i4")), [pa.array(n), pa.array(n * 0.5), pa.array(n % 2 == 0)]
    ),
    "months": pa.array([pa.MonthDayNano([1, 2, 3])] * N),
    "many_digits": pa.array([decimal.Decimal(int(k)) for k in n], pa.decimal128(38, 0)),
    "structs": pa.array([[{"a": 1, "b": "c"}]] * N),
    "runs": pa.RunEndEncodedArray.from_arrays(pa.array([N], pa.int32()), pa.array([1.5])),
    "behind": pa.array(gaps((n / 8).tolist())),
}
types = pa.table(columns)
save("types_plain", types, rows=25)
save("types_stream", types, rows=25, stream=True, compression="zstd")
save("types_legacy", types, rows=40, metadata_version=ipc.MetadataVersion.V4, use_legacy_format=True)
feather.write_feather(types, data / "types_lz4.arrow", chunksize=31)
feather.write_feather(types, data / "types_zstd.arrow", compression="zstd")
for name, compression in [("plain", "uncompressed"), ("lz4", "lz4"), ("zstd", "zstd")]:
    pl.from_arrow(types).write_ipc(data / f"polars_{name}.arrow", compression=compression)
pl.from_arrow(types).write_ipc_stream(data / "polars_stream.arrow", compression="lz4")
for name, options in {"plain": {}, "lz4": {"compression": "lz4"}}.items():
    save(f"others_{name}", pa.table(others), **options)
firm = pa.schema([pa.field("code", pa.int16(), nullable=False), pa.field("y", pa.float64())])
save("codes", pa.table([pa.array((n - 30).astype("i2")), pa.array(n * 0.1)], firm), rows=7)

y = np.cos(n / 5)
fields = [
    pa.field("t", pa.timestamp("us", "UTC")),
    pa.field("acc", pa.float64(), metadata={"unit": "m/s^2", "note": "x"}),
    pa.field("force", pa.float32(), metadata={"units": "N"}),
]
named = pa.table(
    [pa.array(moments).cast(pa.timestamp("us", "UTC")), pa.array(y), pa.array(y.astype("f4"))], pa.schema(fields)
)
save("named", named, rows=16, compression="lz4")
for unit, step in {"s": 1, "ms": 2, "us": 50, "ns": 200_000}.items():
    stamps = np.datetime64("1969-12-31T23:59:59", unit) + n * np.timedelta64(step, unit)
    save(f"moments_{unit}", pa.table({"time_ms": pa.array(stamps), "y": y}))
    save(
        f"differences_{unit}",
        pa.table({"elapsed": pa.array(n * np.timedelta64(step, unit)), "y": y}),
        compression="zstd",
    )
pd.DataFrame({"time": n * 1e-3, "y": y}).to_feather(data / "pandas_times.arrow")
pd.DataFrame({"stamp": moments, "y": y}).to_feather(data / "pandas_moments.arrow", compression="zstd")
feather.write_feather(
    pd.DataFrame({"y": y}, index=n * np.timedelta64(500_000, "ns")), data / "pandas_differences.arrow"
)
feather.write_feather(pd.DataFrame({"y": y}, index=n * 2 + 1), data / "pandas_numbers.arrow")
pl.DataFrame({"t": n * np.timedelta64(200, "us"), "y": y}).write_ipc(data / "polars_differences.arrow")
save("rate", pa.table({"y": y}).replace_schema_metadata({"sample_rate_hz": "2500"}))

small = pa.table(
    {
        "t": pa.array(moments[:9]),
        "y": pa.array([None, *y[:8]]),
        "k": pa.array(n[:9], pa.int32()),
        "s": pa.array(["a"] * 9, pa.string_view()),
        "inner": pa.StructArray.from_arrays([pa.array(n[:9] % 2 == 0)], ["x"]),
    }
)
save("file", small, corpus, rows=4)
save("lz4", small, corpus, compression="lz4")
save("stream", small, corpus, rows=4, stream=True, compression="zstd")
save("old", small.drop(["s"]), corpus, metadata_version=ipc.MetadataVersion.V4, use_legacy_format=True)
pl.from_arrow(small).write_ipc(corpus / "polars.arrow", compression="zstd")
