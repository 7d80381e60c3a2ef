// What the precompiled headers are built for: it holds nothing.
