"""What people see: figures, films, reports, the page in the browser, and the command line."""
