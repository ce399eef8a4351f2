"""Messages of the other services, cached, and calls to them."""
