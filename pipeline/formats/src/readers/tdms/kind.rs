//! Types of values.

/// A type of raw data or property.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Void,
    Int8,
    Int16,
    Int32,
    Int64,
    UInt8,
    UInt16,
    UInt32,
    UInt64,
    Float32,
    Float64,
    Extended,
    Text,
    Boolean,
    Stamp,
    Fixed,
    Complex64,
    Complex128,
    DaqmxRaw,
}

impl Kind {
    /// By the code of metadata.
    pub(super) fn of_code(code: u32) -> Option<Self> {
        Some(match code {
            0 => Self::Void,
            1 => Self::Int8,
            2 => Self::Int16,
            3 => Self::Int32,
            4 => Self::Int64,
            5 => Self::UInt8,
            6 => Self::UInt16,
            7 => Self::UInt32,
            8 => Self::UInt64,
            // 0x19 to 0x1B are "with unit": the same value, the unit is a property.
            9 | 0x19 => Self::Float32,
            10 | 0x1A => Self::Float64,
            11 | 0x1B => Self::Extended,
            0x20 => Self::Text,
            0x21 => Self::Boolean,
            0x44 => Self::Stamp,
            0x4F => Self::Fixed,
            0x0008_000C => Self::Complex64,
            0x0010_000D => Self::Complex128,
            0xFFFF_FFFF => Self::DaqmxRaw,
            _ => return None,
        })
    }

    /// By the code of a DAQmx scaler, which has a list of its own.
    pub(super) fn of_daqmx_code(code: u32) -> Option<Self> {
        const CODES: [Kind; 10] = [
            Kind::UInt8,
            Kind::Int8,
            Kind::UInt16,
            Kind::Int16,
            Kind::UInt32,
            Kind::Int32,
            Kind::UInt64,
            Kind::Int64,
            Kind::Float32,
            Kind::Float64,
        ];
        if code == u32::MAX {
            return Some(Self::Stamp);
        }
        CODES.get(code as usize).copied()
    }

    /// Bytes of one value, where that is fixed.
    pub(super) fn width(self) -> Option<u32> {
        Some(match self {
            Self::Int8 | Self::UInt8 | Self::Boolean => 1,
            Self::Int16 | Self::UInt16 => 2,
            Self::Int32 | Self::UInt32 | Self::Float32 => 4,
            Self::Int64 | Self::UInt64 | Self::Float64 | Self::Complex64 => 8,
            Self::Stamp | Self::Complex128 => 16,
            Self::Void | Self::Extended | Self::Text | Self::Fixed | Self::DaqmxRaw => return None,
        })
    }

    /// Whether a channel of numbers can be made of it.
    pub(super) fn is_number(self) -> bool {
        !matches!(self, Self::Stamp | Self::Complex64 | Self::Complex128) && self.width().is_some()
    }

    /// Whether float64 may round it.
    pub(super) fn is_long(self) -> bool {
        matches!(self, Self::Int64 | Self::UInt64)
    }

    /// Name for people.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Void => "void",
            Self::Int8 => "int8",
            Self::Int16 => "int16",
            Self::Int32 => "int32",
            Self::Int64 => "int64",
            Self::UInt8 => "uint8",
            Self::UInt16 => "uint16",
            Self::UInt32 => "uint32",
            Self::UInt64 => "uint64",
            Self::Float32 => "float32",
            Self::Float64 => "float64",
            Self::Extended => "extended float",
            Self::Text => "text",
            Self::Boolean => "boolean",
            Self::Stamp => "time stamps",
            Self::Fixed => "fixed point",
            Self::Complex64 => "complex64",
            Self::Complex128 => "complex128",
            Self::DaqmxRaw => "DAQmx raw data",
        }
    }
}
