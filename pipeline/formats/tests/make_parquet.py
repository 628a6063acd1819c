"""Writes the small Parquet files in tests/data and the seeds in fuzz/corpus/parquet.

Needs pyarrow, pandas and polars. Run: python tests/make_parquet.py
"""
import decimal
import pathlib

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pyarrow.parquet as pq

here = pathlib.Path(__file__).parent
data, corpus = here / "data", here / "../../../fuzz/corpus/parquet"
corpus.mkdir(parents=True, exist_ok=True)
N = 60
n = np.arange(N)
moments = np.datetime64("2024-05-06T07:08:09.25", "ns") + n * np.timedelta64(200, "us")

columns = {
    "i8": pa.array(n - 30, pa.int8()),
    "u16": pa.array(n * 1000, pa.uint16()),
    "i32": pa.array(n * -70000, pa.int32()),
    "u32": pa.array(n * 70000000, pa.uint32()),
    "i64": pa.array(n * 3 - 7, pa.int64()),
    "u64": pa.array(n * 3, pa.uint64()),
    "f16": pa.array((n / 8).astype("f2")),
    "f32": pa.array((n * 0.1).astype("f4")),
    "f64": pa.array(n * 0.1),
    "truth": pa.array(n % 3 == 0),
    "gaps": pa.array([None if k % 7 == 3 else k / 4 for k in n], pa.float64()),
    "few": pa.array([None if k % 7 == 3 else int(k % 2) for k in n], pa.int32()),
    "decimal": pa.array([decimal.Decimal(int(k)) / 100 for k in n], pa.decimal128(9, 2)),
    "text": pa.array([f"a{k}" for k in n]),
    "lists": pa.array([[1, 2]] * N),
    "inner": pa.StructArray.from_arrays([pa.array(n * 0.5)], ["x"]),
    "day": pa.array(n.astype("i4"), pa.date32()),
}
types = pa.table(columns)
for name, options in {
    "snappy": {},
    "gzip": {"compression": "gzip", "row_group_size": 25},
    "zstd": {"compression": "zstd", "row_group_size": 25},
    "brotli": {"compression": "brotli", "data_page_version": "2.0", "row_group_size": 25},
    "lz4": {"compression": "lz4", "data_page_version": "2.0", "row_group_size": 31},
    "plain": {"compression": "none", "use_dictionary": False, "data_page_size": 64, "write_page_checksum": True},
    "streams": {"compression": "snappy", "use_dictionary": False, "use_byte_stream_split": ["f16", "f32", "f64", "i32"],
                "column_encoding": {"i64": "DELTA_BINARY_PACKED", "u32": "DELTA_BINARY_PACKED"}, "data_page_version": "2.0"},
}.items():
    if name == "streams":
        options["column_encoding"] |= {c: "BYTE_STREAM_SPLIT" for c in options.pop("use_byte_stream_split")}
    pq.write_table(types, data / f"types_{name}.parquet", store_schema=False, write_statistics=False, store_decimal_as_integer=name != "plain", **options)
pq.write_table(types.select(["f64"]), data / "zstd.parquet", compression="zstd")
# packed with Zstandard, as Polars does by itself
pl.from_arrow(types.drop(["decimal"])).write_parquet(data / "types_polars.parquet", row_group_size=25)

y = np.cos(n / 5)
fields = [pa.field("t", pa.timestamp("us", "UTC")), pa.field("acc", pa.float64(), metadata={"unit": "m/s^2", "note": "x"}),
          pa.field("force", pa.float32(), metadata={"units": "N"})]
named = pa.table([pa.array(moments).cast(pa.timestamp("us", "UTC")), pa.array(y), pa.array(y.astype("f4"))], pa.schema(fields))
pq.write_table(named, data / "named.parquet")
for unit in ["ms", "ns"]:
    step = {"ms": 2, "ns": 200_000}[unit]
    stamps = pa.array(np.datetime64("1969-12-31T23:59:59", unit) + n * np.timedelta64(step, unit))
    pq.write_table(pa.table({"stamp_ms" if unit == "ms" else "time_ms": stamps, "y": y}), data / f"moments_{unit}.parquet")
frame = pd.DataFrame({"y": y}, index=moments)
frame.to_parquet(data / "pandas_moments.parquet")
pd.DataFrame({"y": y}, index=n * 1e-3).to_parquet(data / "pandas_times.parquet")
differences = pa.array(n * np.timedelta64(200, "us"))
pq.write_table(pa.table({"elapsed": differences, "y": y}), data / "differences.parquet")
pd.DataFrame({"y": y}, index=n * np.timedelta64(500_000, "ns")).to_parquet(data / "pandas_differences.parquet")
pd.DataFrame({"y": y}, index=n * 2 + 1).to_parquet(data / "pandas_numbers.parquet")
pq.write_table(pa.table({"time": n * 1e-3, "y": y}), data / "times.parquet")
pq.write_table(pa.table({"y": y}).replace_schema_metadata({"sample_rate_hz": "2500"}), data / "rate.parquet")

small = pa.table({"t": pa.array(moments[:9]), "y": pa.array([None, *y[:8]]), "k": pa.array(n[:9], pa.int32())})
pq.write_table(small, corpus / "snappy.parquet", write_statistics=False)
for name in ["zstd", "brotli"]:
    pq.write_table(small, corpus / f"{name}.parquet", compression=name, write_statistics=False)
pq.write_table(small, corpus / "pages2.parquet", compression="lz4", data_page_version="2.0", row_group_size=4, use_dictionary=["k"],
               column_encoding={"t": "DELTA_BINARY_PACKED"}, write_statistics=False)
