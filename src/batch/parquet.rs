//! A table as a Parquet file: one row group, unknown numbers null.

use std::path::Path;
use std::sync::Arc;

use afmid_pipeline::Table;
use afmid_pipeline::artifact::ColumnValues;
use parquet::basic::{ConvertedType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::Result;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::{Type, TypePtr};

/// Writes it. Errors: the file cannot be written.
pub fn write(path: &Path, table: &Table) -> std::io::Result<()> {
    written(path, table).map_err(std::io::Error::other)
}

fn written(path: &Path, table: &Table) -> Result<()> {
    let fields = table.columns.iter().map(|column| field(&column.name, &column.values)).collect::<Result<Vec<_>>>()?;
    let schema = Arc::new(Type::group_type_builder("table").with_fields(fields).build()?);
    // no version of a library in the file: the same table gives the same bytes
    let properties = Arc::new(WriterProperties::builder().set_created_by("afmid".to_owned()).build());
    let mut file = SerializedFileWriter::new(std::fs::File::create(path)?, schema, properties)?;
    let mut group = file.next_row_group()?;
    for column in &table.columns {
        if let Some(mut writer) = group.next_column()? {
            fill(&mut writer, &column.values)?;
            writer.close()?;
        }
    }
    group.close()?;
    file.close()?;
    Ok(())
}

fn field(name: &str, values: &ColumnValues) -> Result<TypePtr> {
    let (physical, repetition, converted) = match values {
        ColumnValues::Real(_) => (Physical::DOUBLE, Repetition::OPTIONAL, ConvertedType::NONE),
        ColumnValues::Integer(_) => (Physical::INT64, Repetition::REQUIRED, ConvertedType::NONE),
        ColumnValues::Flag(_) => (Physical::BOOLEAN, Repetition::REQUIRED, ConvertedType::NONE),
        ColumnValues::Text(_) => (Physical::BYTE_ARRAY, Repetition::REQUIRED, ConvertedType::UTF8),
    };
    let field = Type::primitive_type_builder(name, physical).with_repetition(repetition);
    Ok(Arc::new(field.with_converted_type(converted).build()?))
}

fn fill(writer: &mut SerializedColumnWriter<'_>, values: &ColumnValues) -> Result<usize> {
    match values {
        ColumnValues::Real(values) => {
            let known: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
            let levels: Vec<i16> = values.iter().map(|value| i16::from(value.is_finite())).collect();
            writer.typed::<DoubleType>().write_batch(&known, Some(&levels), None)
        }
        ColumnValues::Integer(values) => writer.typed::<Int64Type>().write_batch(values, None, None),
        ColumnValues::Flag(values) => writer.typed::<BoolType>().write_batch(values, None, None),
        ColumnValues::Text(values) => {
            let values: Vec<ByteArray> = values.iter().map(|text| ByteArray::from(text.as_str())).collect();
            writer.typed::<ByteArrayType>().write_batch(&values, None, None)
        }
    }
}
