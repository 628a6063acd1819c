//! Full disks, read-only folders, clocks that go backwards, several runs on one cache.
