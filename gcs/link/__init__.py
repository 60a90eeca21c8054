"""Datagrams in and out, and their recording: where the ground station touches sockets and files."""
