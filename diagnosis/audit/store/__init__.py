"""What an audit keeps: SQLite database, objects, report folders."""
