"""Reading a user's files and writing ours.

atomic_output    an output folder whose files appear when they are complete
read_file        a file of a user, of limited size and known encoding
integrity        digests at the end of files, and checks of arrays before they are used
text_repr        short representations of results in an interactive session
"""
