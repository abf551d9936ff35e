"""Commands for records: information, parts, exports."""
