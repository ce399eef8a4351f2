"""Episodes of Habitat's ObjectNav and of the paper's multi-object task, in Habitat itself."""
