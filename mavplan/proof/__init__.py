"""What each user really received along a flown track, and how each stop was held. Pure: no files, no link, no clock."""
