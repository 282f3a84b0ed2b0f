"""Which effects could explain the errors, by their tangents."""
