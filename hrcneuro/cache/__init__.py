"""A content-hashed store of stage results: keys, lookup, publish, verify, why, gc. It knows nothing of this study."""
