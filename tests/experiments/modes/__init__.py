"""What the paper claims: end and cloud together against either of them alone, in worlds that are not as mapped."""
