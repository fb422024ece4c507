"""Site: a package's interfaces as static HTML, without anything from elsewhere."""
