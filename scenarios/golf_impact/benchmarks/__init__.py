"""Run time and accuracy of ClubBallImpact.fmu and of other methods (golf_impact.peers)."""
