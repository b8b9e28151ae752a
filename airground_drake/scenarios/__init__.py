"""The scenario file: schema, loading, validation, and the shipped scenarios."""
