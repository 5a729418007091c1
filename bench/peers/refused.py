class Refused(Exception):
    """What has no counterpart in another renderer, in a sentence."""
