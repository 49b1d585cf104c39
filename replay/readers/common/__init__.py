"""What all readers share: their protocol, decompression, message stamps."""
