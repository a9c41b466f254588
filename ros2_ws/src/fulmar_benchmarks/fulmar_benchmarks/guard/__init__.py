"""How well the envelope guard keeps floating robots in their area, whatever their controllers want."""
