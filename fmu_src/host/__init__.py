"""What works around hosts and pythonfmu; nothing in here knows of an impact."""
