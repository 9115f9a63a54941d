"""What the pages of docs/ claim, computed: programs that make their tables and pictures, and that tests import."""
