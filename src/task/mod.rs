//! Task files: schema, validation, regions, editing and saving.
