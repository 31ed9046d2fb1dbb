"""Which pixels of each picture to use: masks for other programs, maps of depth and blur."""
