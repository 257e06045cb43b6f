"""What is sent and answered over HTTP, in human units; a module for each noun."""
