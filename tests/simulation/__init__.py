"""The whole system in one process on one virtual clock: real coroutines, real simulator, no socket, no waiting."""
