"""The worlds of the concealed-effect proof: drives whose truth is known, sealed away before the tool reads them."""
