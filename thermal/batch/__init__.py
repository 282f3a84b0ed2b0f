"""Steps of many members at once: equations of one member, traced once and run on arrays with a last axis of members."""
