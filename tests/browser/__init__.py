"""The web page in a real Chromium: scripted vehicles, whole flights, every button, screenshots."""
