"""Ends of the link that rover and station share: zenoh and UDP sockets, key files."""
