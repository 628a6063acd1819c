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

#[cfg(test)]
mod tests {
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::{Field, RowAccessor};

    use super::*;

    #[test]
    fn what_is_written_is_read_and_unknown_numbers_are_null() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.parquet");
        let table = Table::new()
            .with("name", "", "a name", vec!["a".to_owned(), "µ, \"b\"".to_owned()])
            .with("mode", "1", "a number", vec![1_i64, -2])
            .with("f", "Hz", "a frequency", vec![f64::NAN, 46300.25])
            .with("kept", "", "a flag", vec![true, false]);
        write(&path, &table).unwrap();
        let reader = SerializedFileReader::new(std::fs::File::open(&path).unwrap()).unwrap();
        let rows: Vec<_> = reader.get_row_iter(None).unwrap().map(Result::unwrap).collect();
        assert_eq!(rows.len(), 2);
        assert_eq!(rows[0].get_column_iter().nth(2).unwrap().1, &Field::Null);
        assert_eq!(rows[1].get_string(0).unwrap(), "µ, \"b\"");
        assert_eq!((rows[1].get_long(1).unwrap(), rows[1].get_double(2).unwrap()), (-2, 46300.25));
        assert!(!rows[1].get_bool(3).unwrap());
        let again = folder.path().join("b.parquet");
        write(&again, &table).unwrap();
        assert_eq!(std::fs::read(path).unwrap(), std::fs::read(again).unwrap());
    }

    #[test]
    fn a_table_without_rows_is_a_file_without_rows() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.parquet");
        write(&path, &Table::new().with("name", "", "a name", Vec::<String>::new())).unwrap();
        let reader = SerializedFileReader::new(std::fs::File::open(&path).unwrap()).unwrap();
        assert_eq!(reader.get_row_iter(None).unwrap().count(), 0);
    }
}
