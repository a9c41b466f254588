"""Plans of whole courses for boats: the learned policy's own drive, made quicker by optimal control, and followed."""
