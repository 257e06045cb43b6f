"""What the OpenAPI document shows: requests on the bundled graph and real answers to them."""
