"""What every room may use: errors, checks of arguments, files, progress, tables, and runs of many trials."""
