"""What is known before anything is computed: balls, units, names, published numbers."""
