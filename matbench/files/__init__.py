"""Files on disk and over the network, read and written with care; imports nothing of the harness but its errors."""
