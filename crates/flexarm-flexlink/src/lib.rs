//! Substitution of rigid links by flexible ones on the tree
