"""What requests and answers say of places that are named by a text."""
