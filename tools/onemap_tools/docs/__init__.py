"""The site of the documents, and its pages that are written from the code."""
