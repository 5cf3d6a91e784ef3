%%%
  VERSION:1
  LANGUAGE:ENGLISH
%%%
MODULE Cell
  ! data
  CONST jointtarget jHome := [[10,-20,30,0,45,-60],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pA := [[600,100,700],[0.5,0.5,0.5,0.5],[0,-1,2,1],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pRow{2} := [[[600,0,700],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],
                              [[650,0,700],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]];
  PERS tooldata tPen := [TRUE,[[0,0,120],[0.70710678,0,0.70710678,0]],[0.8,[0,0,50],[1,0,0,0],0,0,0]];
  PERS wobjdata wTable := [FALSE,TRUE,"",[[1000,0,0],[0.70710678,0,0,0.70710678]],[[0,50,20],[1,0,0,0]]];
  VAR speeddata vSlow := [75,30,5000,1000];
  VAR num nCount := 0;

  PROC main()
    VAR robtarget pNext;
    ConfJ\On;
    MoveAbsJ jHome, v1000, fine, tPen;
    MoveJ pA, v500, z10, tPen\WObj:=wTable;
    MoveL Offs(pA,10,0,-30), vSlow, fine, tPen\WObj:=wTable;
    FOR i FROM 2 TO 1 DO
      MoveL pRow{i}, v200\V:=120, z50\Z:=4, tool0;
    ENDFOR
    nCount := nCount + 2;
    IF nCount = 2 THEN
      pNext := pRow{1};
      pNext.trans.z := pNext.trans.z + 40;
      MoveL pNext, v100\T:=3, fine, tool0;
    ENDIF
    MoveC Offs(pRow{1},25,25,40), Offs(pRow{1},50,0,40), v100, z1, tool0;
    VelSet 50, 400;
    AccSet 60, 100;
    step 12\turn:=90;
    SetDO doGrip, 1;
    TPWrite "done";
    WaitTime 0.25;
    WHILE nCount < 4 DO
      Incr nCount;
    ENDWHILE
    TEST nCount
    CASE 1,2: MoveJ pRow{1}, vmax, fine, tool0;
    CASE 4: MoveJ pRow{2}, v1000, fine, tool0;
    DEFAULT: Stop;
    ENDTEST
  ERROR
    RAISE;
  ENDPROC

  PROC step(num height \num turn)
    IF Present(turn) MoveL RelTool(pRow{1},0,0,height\Rz:=turn), v1000, fine, tool0;
  ENDPROC
ENDMODULE
