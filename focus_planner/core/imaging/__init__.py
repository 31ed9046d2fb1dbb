"""What cameras image: depth, blur, pictures."""
