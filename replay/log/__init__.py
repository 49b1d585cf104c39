"""A recorded log as it is: channels, source options, file types, reading notes."""
