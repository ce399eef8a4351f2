"""The HTTP interface: application, middleware, problems, schemas, routes."""
