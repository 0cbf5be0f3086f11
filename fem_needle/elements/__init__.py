"""Line elements with continuous slope: reference matrices, meshes and integrals over parts of them."""
