"""What people look at: the report page, its tables and figures."""
